"""A reference between the two images, as in ISO/IEC 29170-3 (JPEG AIC-3): plain and boosted."""

import hashlib
import io
import json
from html import unescape
from re import search

import numpy as np
import pytest
from PIL import Image

from app import create_app, export
from app.renditions import amplified
from stimuli.errors import InputError
from tests.app.conftest import Person

BOOSTED = {"modes": ["boosted"], "reference": "golubev", "boost": {"amplify": 3}}


def write_images(directory):
    """Noise of each image's own in place of the flat colours of a written study."""
    path = directory / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["format"] = "subdermal-manifest/3"
    for k, one in enumerate(manifest["images"]):
        pixels = np.random.default_rng(k).integers(0, 256, (36, 64, 3)).astype(np.uint8)
        Image.fromarray(pixels).save(directory / one["file"])
        one["sha256"] = hashlib.sha256((directory / one["file"]).read_bytes()).hexdigest()
        one["region"] = [0.25, 0.25, 0.75, 0.75]
    path.write_text(json.dumps(manifest))
    return manifest


def pixels(data):
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def of_question(page):
    """The pictures of a question: left, reference, right."""
    images, reference = (
        json.loads(unescape(search(rf'data-{name}="([^"]*)"', page)[1]))
        for name in ("images", "reference")
    )
    return [images[0], reference, images[1]]


def test_a_difference_is_amplified_exactly():
    grey = np.array([[0, 10, 100, 200, 250]], np.uint8)
    reference = np.array([[5, 10, 90, 210, 240]], np.uint8)
    one, other = (Image.fromarray(np.stack([a] * 3, -1)) for a in (grey, reference))
    assert np.asarray(amplified(one, other, 3))[0, :, 0].tolist() == [0, 10, 120, 180, 255]
    assert np.asarray(amplified(one, other, 1))[0, :, 0].tolist() == grey[0].tolist()
    assert np.asarray(amplified(other, other, 16))[0, :, 0].tolist() == reference[0].tolist()


@pytest.mark.parametrize("accept", ["image/webp", "image/png"])
def test_both_sides_are_boosted_alike_and_without_loss(tmp_path, write_study, accept):
    folder = write_study(tmp_path / "study", viewer=BOOSTED)
    write_images(folder)
    app = create_app(folder)
    study, visitor = app.extensions["study"], person(app)
    left, reference, right = of_question(visitor.get("/question").text)
    trial = visitor.form("trial")
    hashes = [trial["image_left"], study.manifest.reference(cell_of(study, trial)).sha256]
    hashes.append(trial["image_right"])
    raw = [pixels(study.images_by_sha256[one].path.read_bytes())[9:27, 16:48] for one in hashes]
    for seen, image in ((left, raw[0]), (right, raw[2])):
        sent = visitor.http.get(f"{seen['address']}32", headers={"Accept": accept})
        assert sent.mimetype == accept and (seen["width"], seen["height"]) == (32, 18)
        expected = np.clip(raw[1] + 3 * (image - raw[1]), 0, 255)
        np.testing.assert_array_equal(pixels(sent.data), expected)
    sent = visitor.http.get(f"{reference['address']}32")
    np.testing.assert_array_equal(pixels(sent.data), raw[1])
    other = left["address"].replace("/3/", "/4/")
    assert visitor.http.get(f"{other}32").status_code == 404  # another amplification


def person(app):
    return Person(app).begin()


def cell_of(study, form):
    return study.images_by_sha256[form["image_left"]].cell


def test_a_reference_may_have_files_of_its_own(tmp_path, write_study):
    folder = write_study(
        tmp_path / "study", viewer={"modes": ["triplet"], "reference": "files", "zoom": 1}
    )
    manifest = write_images(folder)
    entries = []
    for k, framing in enumerate(("close-up", "head-shot", "half-length")):
        file = f"images/{framing}_reference.png"
        Image.new("RGB", (64, 36), (k, 2, 3)).save(folder / file)
        digest = hashlib.sha256((folder / file).read_bytes()).hexdigest()
        entry = {"framing": framing, "file": file, "sha256": digest, "width": 64, "height": 36}
        entries.append(entry)
    manifest["references"] = entries
    write = lambda: (folder / "manifest.json").write_text(json.dumps(manifest))
    write()
    app = create_app(folder)
    study, visitor = app.extensions["study"], person(app)
    _, reference, _ = of_question(visitor.get("/question").text)
    sent = visitor.http.get(f"{reference['address']}32")
    k = ("close-up", "head-shot", "half-length").index(cell_of(study, visitor.form("trial")))
    assert pixels(sent.data)[0, 0].tolist() == [k, 2, 3]
    assert "Which image is closer to the reference?" in visitor.page.text
    seen = study.content(images=True)["images"]
    assert len(seen) == 18 and seen["close-up files"] == entries[0]["sha256"]
    entries[0]["width"] = 32
    write()
    with pytest.raises(InputError, match=r"references\[0\].width, height: .*as the images at"):
        create_app(folder)
    del entries[0]
    write()
    with pytest.raises(InputError, match="references: none at close-up"):
        create_app(folder)


def test_what_was_shown_is_exported(tmp_path, write_study):
    folder = write_study(tmp_path / "study", viewer=BOOSTED)
    app = create_app(folder)
    study, visitor = app.extensions["study"], person(app)
    visitor.send("trial", answer=1, rt_ms=900, view="boosted", boosted_ms=800, flips=7)
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, study, simulated=False)
    assert (row["view"], row["boosted_ms"], row["triplet_ms"]) == ("boosted", 800, None)
    assert row["flips"] == 7
    codebook = export.codebook_md(study, simulated=False)
    assert "Question: Which image is closer to the reference?" in codebook
    assert "reference `golubev` between" in codebook and "times 3" in codebook


@pytest.mark.parametrize(
    "viewer, error",
    [
        ({"modes": ["triplet"]}, "viewer.reference: missing, expected one of none, .*, files"),
        ({"modes": ["triplet", "wipe"], "reference": "none"}, "or triplet or boosted alone"),
        ({"modes": ["beside"], "reference": "none"}, "viewer.reference: unknown key"),
        ({"modes": ["boosted"], "reference": "none", "display": "fit"}, "one of 1:1"),
        ({"modes": ["boosted"], "reference": "none", "scripts": "optional"}, "one of required"),
        (
            {"modes": ["boosted"], "reference": "none", "boost": {"amplify": 0}},
            "viewer.boost.amplify: got 0, expected a number from 1 to 16",
        ),
        ({"modes": ["triplet"], "reference": "none", "boost": {}}, "boost: unknown key"),
        ({"modes": ["triplet"], "reference": "files"}, "references: missing"),
    ],
)
def test_what_is_no_triplet_is_refused(tmp_path, write_study, viewer, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", viewer=viewer))
