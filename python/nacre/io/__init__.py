"""Files: points, meshes, images, cameras and trajectories, in and out."""
