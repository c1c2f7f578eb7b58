"""Noise along the rays must not move surfaces that are seen at a slant."""

import numpy as np

import nacre

RADIUS = 0.02
CENTRE = np.array([0.0, 0.0, 0.1])


def test_noise_leaves_the_slanted_parts_of_a_ball_where_they_are() -> None:
    pixel, size, sigma = 0.0005, 101, 0.0005
    camera = nacre.Camera.orthographic(size, size, pixel)
    u = (np.arange(size) - (size - 1) / 2) * pixel
    squared = u[None, :] ** 2 + u[:, None] ** 2
    depth = np.where(squared < RADIUS**2, CENTRE[2] - np.sqrt(np.maximum(0.0, RADIUS**2 - squared)), np.nan)
    offsets = []
    for seed in range(10):
        model = nacre.Model(camera)
        noise = sigma * np.random.default_rng(seed).standard_normal(depth.shape)
        model.add_frame((depth + noise).astype(np.float32))
        rays = model.points - CENTRE
        distance = np.linalg.norm(rays, axis=1)
        facing = -rays[:, 2] / distance
        offsets.append(distance[(facing > 0.4) & (facing < 0.5)] - RADIUS)
    # Weights that depend on the noise put them 29 micrometres too deep; the mean's own error is 2.
    assert abs(np.concatenate(offsets).mean()) < 1.5e-5
