"""Where the skin is what: fields of a person, and one line for what cannot be."""

import numpy as np
import pytest

from renderer.errors import InputError
from renderer.scene import MASKS
from stimuli.heads import anatomy as anatomies
from stimuli.heads import fetch, skin
from stimuli.heads.person import Person
from stimuli.heads.regions import Regions


@pytest.fixture(scope="module")
def bust():
    anatomy = anatomies.build_anatomy(fetch.mpfb_data(), Person(), levels=1)
    return anatomy, anatomy.fine


def column(bust, name, **table):
    regions = Person.read({"regions": table}, "person").regions
    return skin.masks(*bust, regions=regions)[:, MASKS.index(name)]


def test_flush_lies_where_it_is_said_to(bust):
    """Without any on the nose its tip is as pale as what is around it; elsewhere nothing moves."""
    usual, pale = column(bust, "flush"), column(bust, "flush", flush={"nose": 0.0, "wings": 0.0})
    tip = np.linalg.norm(bust[1].positions - bust[0].landmarks["nose"], axis=1)
    assert usual[tip < 5].min() > 0.6 and pale[tip < 5].max() < 0.4
    np.testing.assert_allclose(usual[tip > 80], pale[tip > 80], atol=1e-7)


def test_a_higher_hairline_bares_the_forehead(bust):
    usual = column(bust, "hair")
    high = column(bust, "hair", hairline=[[0, 95], [60, 80], [180, -70]])
    p, eyes = bust[1].positions, bust[0].landmarks["eyes"]
    strip = (p[:, 2] > 60) & (np.abs(p[:, 1] - eyes[1] - 75) < 6)
    assert strip.sum() > 20 and high[strip].mean() < 0.15 < 0.9 < usual[strip].mean()


def test_the_hairline_fades_across_itself():
    """Beside a sideburn's steep edge what counts is the way to it, not to the line's height."""
    regions = Regions(hairline=((0, 60), (60, 60), (60.5, -20), (180, -20)))
    degrees, up = np.array([50.0, 70.0, 20.0]), np.array([20.0, 20.0, 52.0])
    within = skin._within_line(degrees, up, regions, 0.0)
    a_degree = np.radians(skin.HEAD_MM)
    np.testing.assert_allclose(within, [-10.25 * a_degree, 9.75 * a_degree, -8.0], atol=0.2)


def test_a_table_goes_over_the_defaults_place_by_place():
    regions = Regions.read({"oil": {"nose": 1.0}}, "person.regions")
    assert regions.oil["nose"] == 1.0 and regions.oil["forehead"] == Regions().oil["forehead"]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"flush": {"knee": 1}}, "person.regions.flush.knee is unknown"),
        ({"oil": {"nose": "much"}}, "person.regions.oil.nose is 'much'; expected -2 to 2"),
        ({"hairline": [[0, 60], [0, 50]]}, "expected two or more, 0 to 180, rising"),
        ({"beard_top": 3}, "expected pairs of degrees and mm"),
        ({"nose_mm": 0}, "person.regions.nose_mm is 0 mm; expected 1.0 to 100.0"),
        ({"brow": 1}, "person.regions.brow is unknown"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(table, words):
    with pytest.raises(InputError) as caught:
        Person.read({"regions": table}, "person")
    assert words in str(caught.value) and "\n" not in str(caught.value)
