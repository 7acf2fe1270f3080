"""Connected components and minimum cuts of graphs, as scipy computes them."""

import numpy as np


def components(count: int, links: np.ndarray) -> np.ndarray:
    """Connected component of each of `count` nodes, from 0, by the links (m, 2) between them."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def source_side(a: np.ndarray, b: np.ndarray, capacity: np.ndarray, source: np.ndarray, sink: np.ndarray) -> np.ndarray:
    """Mask of the nodes on the source's side of the min-cut: links between nodes `a` and `b`, and each node's two ends."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = len(source)
    nodes = np.arange(count)
    rows = np.concatenate([a, b, np.full(count, count), nodes])
    columns = np.concatenate([b, a, nodes, np.full(count, count + 1)])
    values = np.concatenate([capacity, capacity, source, sink]).round().clip(0, 2**31 - 1).astype(np.int32)
    matrix = csr_matrix((values, (rows, columns)), shape=(count + 2, count + 2))
    residual = matrix - maximum_flow(matrix, count, count + 1).flow
    residual.data = (residual.data > 0).astype(np.int32)
    residual.eliminate_zeros()
    inside = np.zeros(count + 2, bool)
    inside[breadth_first_order(residual, count, return_predecessors=False)] = True
    return inside[:count]
