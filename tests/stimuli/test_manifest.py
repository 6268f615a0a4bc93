"""The manifest of ready-made images loads, and what is wrong in one is named."""

import json

import PIL.Image
import pytest

from stimuli.errors import InputError
from stimuli.manifest import load_manifest
from stimuli.study import THESIS, load_study


@pytest.fixture
def change(ready_made):
    """Edits the ready-made manifest through a function of its contents."""

    def edit(by):
        path = ready_made / "manifest.json"
        value = json.loads(path.read_text())
        by(value)
        path.write_text(json.dumps(value))
        return ready_made

    return edit


def test_ready_made_images_are_a_study(ready_made):
    manifest = load_manifest(ready_made)
    assert manifest.study.title == "Which engine?"
    assert manifest.study.question == load_study(THESIS).question
    assert len(manifest.images) == 4 and manifest.licences == ()
    image = manifest.image("far", "blender")
    assert (image.width, image.height, image.media_type) == (6, 4, "image/png")
    assert image.path == ready_made / "far-blender.png" and image.path.is_file()
    assert image.renderer is None and image.head is None and image.parameters == {}
    with pytest.raises(KeyError):
        manifest.image("far", "none")


def test_own_question_and_scale_are_kept(change):
    def ask(value):
        value["study"]["question"] = {
            "text": "Which is softer?",
            "left_label": "Left",
            "right_label": "Right",
        }
        value["study"]["scale"] = [{"value": v, "label": f"{v:+d}"} for v in range(-2, 3)]

    study = load_manifest(change(ask)).study
    assert study.question.text == "Which is softer?"
    assert [level.label for level in study.scale] == ["-2", "-1", "+0", "+1", "+2"]


@pytest.mark.parametrize(
    ("by", "message"),
    [
        (
            lambda m: m.update(format="other/1"),
            r"format is 'other/1', expected one of subdermal-manifest/1, subdermal-manifest/2",
        ),
        (lambda m: m.update(extra=1), r"extra: unknown key"),
        (lambda m: m.pop("study"), r"study: missing, expected a table"),
        (lambda m: m["study"].pop("title"), r"study\.title: missing"),
        (lambda m: m["study"].update(render={}), r"study\.render: unknown key"),
        (
            lambda m: m["study"]["techniques"][0].update(label=""),
            r"study\.techniques\[0\]\.label: got ''",
        ),
        (lambda m: m.update(images=[]), r"images: got \[\], expected a list of at least 1 tables"),
        (
            lambda m: m["images"][0].update(measures={"ms": 1}),
            r"images\[0\]\.measures names 'ms', expected one of samples_per_pixel",
        ),
        (
            lambda m: m["images"][0].update(measures={"dssim": -1}),
            r"images\[0\]\.measures\.dssim is -1, expected a number from 0",
        ),
        (
            lambda m: m["images"][0].update(region=[0, 0, 2, 1]),
            r"images\[0\]\.region is \[0, 0, 2, 1\], expected \[left, top, right, bottom\]",
        ),
        (
            lambda m: m["images"][0].update(region=[0, 0, 0.5, 1]),
            r"images\[1\]\.region: got .*, expected \[0\.0, 0\.0, 0\.5, 1\.0\], as the other",
        ),
        (lambda m: m["images"].pop(), r"images: none of blender at far"),
        (
            lambda m: m["images"].append(dict(m["images"][0], file="x.png")),
            r"images\[4\]: a second image of unreal at near",
        ),
        (
            lambda m: m["images"][1].update(file="near-unreal.png"),
            r"images\[1\]\.file: .* differs from that of images\[0\]",
        ),
        (
            lambda m: m["images"][1].update(technique="unity"),
            r"images\[1\]\.technique: got 'unity', expected one of unreal",
        ),
        (
            lambda m: m["images"][0].update(file="../near-unreal.png"),
            r"images\[0\]\.file: .* inside the study's folder",
        ),
        (
            lambda m: m["images"][0].update(file="/etc/passwd.png"),
            r"images\[0\]\.file: .* inside the study's folder",
        ),
        (lambda m: m["images"][0].update(file="near.svg"), r"images\[0\]\.file: .* ends in .png"),
        (
            lambda m: m["images"][0].update(file="gone.png"),
            r"images\[0\]\.file: got 'gone.png', expected a file that is there",
        ),
        (
            lambda m: m["images"][0].update(sha256="0" * 64),
            r"images\[0\]\.sha256: .* changed after the manifest",
        ),
        (
            lambda m: m["images"][0].update(sha256="0"),
            r"images\[0\]\.sha256: got '0', expected 64 hexadecimal digits",
        ),
        (
            lambda m: m["images"][0].update(width=13),
            r"images\[1\]\.width, height: got \(12, 8\), expected \(13, 8\), as the other",
        ),
        (
            lambda m: [i.update(width=7) for i in m["images"][2:]],
            r"images\[2\]\.width, height: .* expected \(6, 4\), the size of",
        ),
        (lambda m: m.update(licences=[{"what": "x"}]), r"licences\[0\]\.licence: missing"),
    ],
)
def test_faults_are_named(change, by, message):
    with pytest.raises(InputError, match=message) as caught:
        load_manifest(change(by))
    assert "\n" not in str(caught.value)


def test_changed_image_is_refused_unless_not_verified(ready_made):
    PIL.Image.new("RGB", (12, 8)).save(ready_made / "near-unreal.png")
    with pytest.raises(InputError, match="changed after the manifest"):
        load_manifest(ready_made)
    assert len(load_manifest(ready_made, verify=False).images) == 4


def test_file_that_is_no_image(change, ready_made):
    import hashlib

    (ready_made / "near-unreal.png").write_bytes(b"not an image")
    digest = hashlib.sha256(b"not an image").hexdigest()
    with pytest.raises(InputError, match="expected an image that can be read"):
        load_manifest(change(lambda m: m["images"][0].update(sha256=digest)))


def test_images_have_the_region_of_their_framing_or_their_own(change):
    def regions(manifest):
        manifest["study"]["framings"][0]["region"] = [0, 0, 0.5, 1]
        for image in manifest["images"][2:]:
            image["region"] = [0.25, 0.25, 0.75, 0.75]

    images = load_manifest(change(regions)).images
    assert {image.region for image in images[:2]} == {(0, 0, 0.5, 1)}
    assert {image.region for image in images[2:]} == {(0.25, 0.25, 0.75, 0.75)}


def test_no_manifest_names_the_command_that_writes_one(tmp_path):
    with pytest.raises(
        InputError, match="manifest.json: cannot be read: .* `subdermal build STUDY.toml --out"
    ):
        load_manifest(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"), [("{", "not JSON"), ("[]", "format is 'list', expected one of")]
)
def test_no_table(tmp_path, text, message):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=message):
        load_manifest(tmp_path)
