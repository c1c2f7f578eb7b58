"""Images of one surface, brought to one brightness."""

import numpy as np
import pytest

from nacre.meshing.texture_exposure import image_gains, light_falloff


def test_gains_of_images_that_overlap_in_a_chain():
    colors = np.random.default_rng(0).uniform(40, 100, (300, 3))
    truth = np.array([[1.0, 1.1, 0.9], [1.5, 1.4, 1.2], [0.8, 0.9, 1.0], [2.0, 1.9, 1.8]])
    is_visible = np.zeros((4, 300), bool)
    for i in range(4):
        is_visible[i, 60 * i : 60 * i + 120] = True
    seen = colors * truth[:, None]
    seen[1, 70:80] = 240  # gloss
    gains = image_gains(seen, is_visible)
    assert np.abs(gains * truth / (gains * truth)[0] - 1).max() < 0.01
    assert np.abs(np.log(gains).mean(axis=0)).max() < 1e-9


def seen_through_a_lens(light, seed):
    """Return colours of places in 20 images of an uneven light of their own; where they are; what is seen."""
    rng = np.random.default_rng(seed)
    is_visible = rng.uniform(size=(20, 2000)) < 0.3
    radii = np.sqrt(rng.uniform(0, 1, is_visible.shape))
    places = rng.uniform(60, 120, (2000, 3))
    own = rng.normal(0, 0.2, (20, 1)) + rng.normal(0, 0.05, (20, 1)) * radii
    noise = rng.normal(0, 0.03, is_visible.shape)
    return places * (light(radii) * np.exp(own + noise))[..., None], radii, is_visible


@pytest.mark.parametrize("seed", range(3))
def test_the_light_that_corners_lack_is_found(seed):
    """As of a lens of 80 degrees across the diagonal: by the fourth power of the cosine."""

    def light(radii):
        return np.cos(np.arctan(np.tan(np.radians(40)) * radii)) ** 4

    falloff = light_falloff(*seen_through_a_lens(light, seed))
    radii = np.linspace(0, 1, 11)
    assert (
        np.abs(falloff.factors(radii) * light(radii) - 1).max() < 0.03
    )  # where 0.34 are left at the corners


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("light", [np.ones_like, lambda radii: 1 + 0.3 * radii**2], ids=["even", "brighter"])
def test_a_lens_without_falloff_is_left_as_it_is(light, seed):
    """Nor is a corner darkened: no lens has more light there."""
    falloff = light_falloff(*seen_through_a_lens(light, seed))
    assert not falloff.is_seen
    assert (falloff.factors(np.linspace(0, 1, 11)) == 1).all()


def test_few_images_tell_nothing_of_their_lens():
    colors, radii, is_visible = seen_through_a_lens(lambda radii: 1 - 0.5 * radii**2, 0)
    assert not light_falloff(colors[:7], radii[:7], is_visible[:7]).is_seen
    assert light_falloff(colors[:8], radii[:8], is_visible[:8]).is_seen


def test_farther_out_than_places_are_the_light_is_that_of_the_farthest():
    colors, radii, is_visible = seen_through_a_lens(lambda radii: 1 - 0.5 * radii**2, 0)
    falloff = light_falloff(colors, radii, is_visible & (radii < 0.6))
    assert 0.55 < falloff.radius < 0.6
    assert falloff.factors(np.array(2.0)) == falloff.factors(np.array(falloff.radius))
