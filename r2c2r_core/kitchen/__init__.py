"""What kitchens are, each fact once: categories and what people call them, the wall behind a front, the front of a mesh."""
