"""The comparison strip shows the study's own pixels."""

import numpy as np
import PIL.Image
import pytest

from app.cli import main
from stimuli.errors import InputError
from stimuli.manifest import load_manifest
from stimuli.strip import BAND_PX, GAP_PX, parse_crop, strip


def test_columns_are_the_conditions_pixel_for_pixel(ready_made):
    manifest = load_manifest(ready_made)
    framing = manifest.study.framings[0].name
    width, height = manifest.images[0].width, manifest.images[0].height
    sheet = np.asarray(
        strip(ready_made, [framing], [(2, 1, width - 4, height - 3), (0, 0, width - 4, 4)])
    )
    for k, condition in enumerate(manifest.study.techniques):
        image = next(
            i for i in manifest.images if (i.framing, i.technique) == (framing, condition.name)
        )
        pixels = np.asarray(PIL.Image.open(image.path).convert("RGB"))
        left = k * (width - 4 + GAP_PX)
        np.testing.assert_array_equal(
            sheet[BAND_PX : BAND_PX + height - 3, left : left + width - 4],
            pixels[1 : height - 2, 2 : width - 2],
        )
        second = BAND_PX + height - 3 + GAP_PX
        np.testing.assert_array_equal(
            sheet[second : second + 4, left : left + width - 4], pixels[:4, : width - 4]
        )


def test_framings_are_rows(ready_made):
    name = load_manifest(ready_made).study.framings[0].name
    one = np.asarray(strip(ready_made, [name], []))
    two = np.asarray(strip(ready_made, [name, name], []))
    np.testing.assert_array_equal(two[: len(one)], one)
    np.testing.assert_array_equal(two[len(one) + GAP_PX :], one[BAND_PX:])


@pytest.mark.parametrize("text", ["", "10", "10x10", "0x10+1+1", "axb+1+1", "10x10-1+1"])
def test_bad_crops_are_refused(text):
    with pytest.raises(InputError, match="expected WIDTHxHEIGHT"):
        parse_crop(text)


def test_what_does_not_fit_is_refused_in_one_line(ready_made, tmp_path, capsys):
    framing = load_manifest(ready_made).study.framings[0].name
    for arguments in (["--crop", "999x10+0+0"], ["-f", "nowhere"], []):
        out = tmp_path / ("x.png" if arguments else "x.jpg")
        assert main(["strip", str(ready_made), "-f", framing, *arguments, "-o", str(out)]) == 2
        assert capsys.readouterr().err.count("\n") == 1 and not out.exists()
