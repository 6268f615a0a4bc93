"""What is sent of an image: the same pixels, smaller; or one resampling of them."""

import io

import numpy as np
import pytest
from PIL import Image

from app import create_app, renditions

PHOTOGRAPH = "image/avif,image/webp,*/*;q=0.8"  # what browsers accept for an image


@pytest.fixture
def study_dir(tmp_path, write_study):
    return write_study(
        tmp_path / "study",
        size=(160, 90),
        framings=[
            {"name": "close-up", "label": "near", "region": [0.1, 0.2, 0.9, 0.8]},
            {"name": "head-shot", "label": "middle"},
            {"name": "half-length", "label": "far"},
        ],
    )


@pytest.fixture
def shown(app):
    """The image of the first technique at a framing and what is answered for it."""
    noise = np.random.default_rng(5).integers(0, 256, (90, 160, 3)).astype(np.uint8)
    study = app.extensions["study"]
    for image in study.manifest.images:
        Image.fromarray(noise).save(image.path)
    app = create_app_again(app)

    def get(framing, width=None, accept=PHOTOGRAPH):
        image = app.extensions["study"].image(framing, "none")
        left, top, right, bottom = image.box
        address = f"/images/{image.sha256}/{left}-{top}-{right}-{bottom}"
        reply = app.test_client().get(
            f"{address}/{right - left if width is None else width}", headers={"Accept": accept}
        )
        return noise[top:bottom, left:right], reply

    return get


def create_app_again(app):
    """The manifest with the hashes that its files have now."""
    import json

    from stimuli.manifest import sha256

    study = app.extensions["study"]
    path = study.directory / "manifest.json"
    manifest = json.loads(path.read_text())
    for one in manifest["images"]:
        one["sha256"] = sha256(study.directory / one["file"])
    path.write_text(json.dumps(manifest))
    return create_app(study.directory)


def pixels(reply):
    return np.asarray(Image.open(io.BytesIO(reply.data)).convert("RGB"))


@pytest.mark.parametrize("framing", ["close-up", "head-shot"])
def test_a_browser_that_takes_webp_gets_the_pixels_of_the_png_in_fewer_bytes(shown, framing):
    noise, webp = shown(framing)
    _, png = shown(framing, accept="image/png,*/*")
    assert (webp.mimetype, png.mimetype) == ("image/webp", "image/png")
    np.testing.assert_array_equal(pixels(webp), noise)
    np.testing.assert_array_equal(pixels(png), noise)
    assert len(webp.data) < len(png.data)
    for reply in (webp, png):
        assert reply.headers["Vary"] == "Accept" and "immutable" in reply.headers["Cache-Control"]


def test_a_window_gets_one_resampling_that_keeps_the_light(shown):
    noise, reply = shown("head-shot", width=80)
    found = pixels(reply)
    assert found.shape == (45, 80, 3)

    def light(encoded):
        return np.mean(np.where(encoded <= 10, encoded / 255 / 12.92, (encoded / 255) ** 2.2))

    assert light(found) == pytest.approx(
        light(noise), rel=0.03
    )  # averaged as encoded it is 20 % less
    assert light(np.full_like(noise, noise.mean().astype(np.uint8))) < 0.8 * light(noise)


@pytest.mark.parametrize("width", [0, 17, 656, 8208, 10**9])
def test_no_other_sizes_are_made(shown, width):
    assert shown("head-shot", width=width)[1].status_code == 404


def test_a_changed_file_is_never_sent(shown, study_dir):
    assert shown("close-up")[1].status_code == 200
    for file in (study_dir / "images").iterdir():
        Image.fromarray(np.zeros((90, 160, 3), np.uint8)).save(file)
    assert shown("close-up")[1].status_code == 404


def test_what_was_longest_unused_goes_when_there_is_too_much(shown, study_dir, monkeypatch):
    folder = study_dir / renditions.FOLDER
    shown("head-shot")
    (first,) = folder.iterdir()
    monkeypatch.setattr(renditions, "MOST_BYTES", first.stat().st_size + 100)
    shown("head-shot", width=64)
    shown("close-up")
    assert first not in folder.iterdir()
    assert shown("head-shot")[1].status_code == 200  # made again
