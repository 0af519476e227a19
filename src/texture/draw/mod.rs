//! Textures drawn by the program from a recipe.
