"""Segmentation (paper 4.1): clicks on a capture become an object's mask in every frame, and its measured front or box.

| package    | method                                                                                                      |
|------------|-------------------------------------------------------------------------------------------------------------|
| mosaics    | orthomosaic of a vertical plane: line evidence, relief, network log-odds, edges, handles                    |
| runs       | its most probable partition into fronts; colour contrast of their edges                                     |
| motion     | a leaf relative to its unit: its joint and its state in every frame, from depth                             |
| fronts     | the clicked panel as a rectangle on its plane; open drawers and doors                                       |
| things     | free-standing objects: min-cut of the fused surface; small ones by visual hull                              |
| appliances | an upright box behind a front                                                                               |
| proposals  | objects proposed before any click                                                                           |
| geometric  | the weight-free segmenter: a session that routes clicks to the packages above                               |
| learned    | the same with masks of a video model (SAM 2, SAM 3, EdgeTAM), fused with depth                              |

A package imports only from packages above it in this table. The modules beside the packages are their common base: the
prepared capture (scene, surface, planes), visibility, view selection, and the protocol. No package has more than five import
levels (tests/test_architecture.py).
"""
