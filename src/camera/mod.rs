//! Cameras, tiles and ray generation. (being built)
