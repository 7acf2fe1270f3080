"""Array shapes as types. Checked in the tests through jaxtyping's import hook; free in production."""

import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8

Points = Float[np.ndarray, "n 3"]
PointField = Float[np.ndarray, "*shape 3"]  # one point, a list or an image of them
PixelField = Float[np.ndarray, "*shape 2"]
Vector3 = Float[np.ndarray, "3"]
Vector2 = Float[np.ndarray, "2"]
Pixels = Float[np.ndarray, "n 2"]
Matrix3 = Float[np.ndarray, "3 3"]
Matrix4 = Float[np.ndarray, "4 4"]
Faces = Integer[np.ndarray, "m 3"]
TextureCoords = Float[np.ndarray, "n 2"]
DepthMetres = Float[np.ndarray, "h w"]  # z-depth along the optical axis; 0 where invalid
Mask = Bool[np.ndarray, "h w"]
Image = UInt8[np.ndarray, "h w 3"]  # RGB order
Texture = UInt8[np.ndarray, "rows columns 3"]  # RGB; a size of its own beside the image it is seen in
Colours = UInt8[np.ndarray, "n 3"]
