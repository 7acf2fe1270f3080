"""Segmentation (paper 4.1): clicks on a capture become an object's mask in every frame, and its measured front or box.

| room       | method                                                                                                      |
|------------|-------------------------------------------------------------------------------------------------------------|
| mosaics    | a vertical plane as an orthomosaic: line evidence, relief, the odds of networks, edges, handles            |
| runs       | its partition into panels by a recursive XY-cut; face frames, stiles                                        |
| motion     | a leaf against its unit: the joint it hangs on and its state in every frame, from depth                     |
| fronts     | the panel under the clicks as a rectangle on its plane; drawers and doors that stand open                   |
| things     | free-standing things: min-cut of the fused surface; small ones by visual hull                               |
| appliances | an upright box behind a front                                                                               |
| proposals  | what is there before anyone clicks                                                                          |
| geometric  | the weight-free segmenter: a session that sends clicks to the rooms above                                   |
| learned    | the same with masks of a video model (SAM 2, SAM 3, EdgeTAM), fused with depth                              |

A room imports from the rooms above it in this table only; the modules beside the rooms are what all of them stand on: the
prepared capture (scene, surface, planes), visibility, view selection, and the protocol. No room has more than five import
levels (tests/test_architecture.py).
"""
