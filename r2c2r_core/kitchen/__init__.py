"""Domain knowledge of kitchens: categories and their names, the wall behind a front, the front plane of a mesh."""
