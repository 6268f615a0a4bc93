"""Every text of the participant's pages in each language, and the way to it."""

import io
import json
import re
from pathlib import Path

import pytest
from babel.messages import extract, mofile, pofile

from app import create_app, errors
from app.catalogues import FOLDER, catalogue
from app.models import Participant
from app.recruiting import Door
from app.study import RECORDED
from stimuli.errors import InputError
from stimuli.languages import LANGUAGES
from stimuli.study import THESIS, load_study

ROOT = Path(__file__).resolve().parents[2]
FURTHER = [language for language in LANGUAGES if language != "en"]
ITALIAN = {
    "title": "Quale?",
    "question": {"text": "Quale è più reale?", "left_label": "A", "right_label": "B"},
}
PORTUGUESE, CHINESE = {"title": "Qual?"}, {"title": "哪一个？"}
TEXT = {"it": ITALIAN, "pt": PORTUGUESE, "zh": CHINESE}
ASKED = {
    "languages": ["en", "it", "pt", "zh"],
    "question": {"text": "Which is more real?", "left_label": "A", "right_label": "B"},
    "text": {
        language: {
            "question": {"text": f"{language}?", "left_label": "A", "right_label": "B"},
            **text,
        }
        for language, text in TEXT.items()
    },
}


def messages():
    """What the sources ask gettext for: singular, or singular and plural."""
    config = {"python": ["app/**.py"], "jinja2": re.findall(r"jinja2: (\S+)]", CONFIG)}
    keywords = {**extract.DEFAULT_KEYWORDS, "message": None, "lazy_gettext": None}
    methods = [(pattern, method) for method, list_ in config.items() for pattern in list_]
    rows = extract.extract_from_dir(ROOT, methods, keywords=keywords)
    return {message for _, _, message, _, _ in rows if message}


CONFIG = (FOLDER / "babel.cfg").read_text()


def po(language):
    with (FOLDER / language / "LC_MESSAGES" / "messages.po").open("rb") as file:
        return pofile.read_po(file, locale=language, abort_invalid=True)


@pytest.fixture(scope="module")
def asked():
    return messages()


@pytest.mark.parametrize("language", FURTHER)
def test_every_message_is_translated_and_has_the_same_places_and_marks(language, asked):
    catalogue = po(language)
    known = {tuple(m.id) if isinstance(m.id, list | tuple) else m.id: m for m in catalogue if m.id}
    assert len(asked) > 150 and known.keys() == asked
    for source, message in known.items():
        assert not message.fuzzy, source
        given = message.string if isinstance(message.string, tuple) else (message.string,)
        assert len(given) == (catalogue.num_plurals if isinstance(source, tuple) else 1), source
        for text in given:
            source_text = source[-1] if isinstance(source, tuple) else source
            one_only = isinstance(source, tuple) and text is given[0]
            assert text.strip(), source
            for pattern in (r"%\(\w+\)s", r"(?<!%)\{\w+\}", r"</?\w+", r"&\w+;"):
                wanted, got = (sorted(re.findall(pattern, one)) for one in (source_text, text))
                if pattern == r"&\w+;":  # quotation marks may be a language's own
                    continue
                assert got == wanted or (one_only and not got), (source, text)


@pytest.mark.parametrize("language", FURTHER)
def test_what_is_compiled_is_what_is_written(language):
    """`make translations` was run after the last change."""
    compiled = io.BytesIO()
    mofile.write_mo(compiled, po(language))
    place = FOLDER / language / "LC_MESSAGES" / "messages.mo"
    assert place.read_bytes() == compiled.getvalue()


def test_what_is_marked_for_later_is_translated(asked):
    assert {*RECORDED, *(door.value for door in Door if door.value)} <= asked
    for language in FURTHER:
        words = catalogue(language)
        assert all(words.gettext(text) != text for text in RECORDED)


def test_the_thesis_is_asked_in_every_language():
    thesis = load_study(THESIS)
    assert thesis.languages == tuple(LANGUAGES)
    titles = {thesis.translated(language).title for language in thesis.languages}
    assert len(titles) == len(LANGUAGES)
    assert thesis.translated("it").familiarity.labels[-1] == "Elevata familiarità"  # section 5.1


@pytest.fixture
def app(tmp_path, write_study):
    return create_app(write_study(tmp_path / "study", **ASKED))


def test_the_browser_is_answered_in_its_language_and_another_can_be_chosen(person):
    visitor = person()
    visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = "fr, pt-BR;q=0.8, en;q=0.5"
    page = visitor.get("/").text
    assert '<html lang="pt">' in page and "Começar" in page and "Qual?" in page
    assert "sua autoavaliação" in page and "{recorded}" not in page
    visitor.send("at", language="zh")
    assert visitor.path == "/" and '<html lang="zh-Hans">' in visitor.page.text
    assert "哪一个？" in visitor.page.text and "开始" in visitor.page.text
    visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = "de"
    assert "开始" in visitor.get("/").text  # what was chosen stays
    assert '<html lang="en">' in person().get("/").text


def test_the_place_is_kept_and_both_languages_are_recorded(person, app):
    visitor = person()
    visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = "it-CH"
    visitor.begin().answer(1)
    assert "Domanda 2" in visitor.page.text
    visitor.send("at", language="en")
    assert visitor.path == "/question" and "Question 2" in visitor.page.text
    visitor.answer(-1)
    assert [row.language for row in visitor.rows] == ["it", "en"]
    visitor.get("/withdraw")
    visitor.send("at", language="zh")
    assert visitor.path == "/withdraw" and "退出" in visitor.page.text
    with app.extensions["database"].read() as db:
        one = db.get(Participant, 1)
        study = app.extensions["study"]
        assert one.consent_language == "it"
        assert one.consent_sha256 == study.consent_sha256("it") != study.consent_sha256("zh")


def test_the_table_says_in_which_language_and_the_codebook_which_consent(person, experimenter, app):
    visitor = person()
    visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = "zh"
    visitor.begin().answer(1)
    from app import export

    study = app.extensions["study"]
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, study, simulated=False)
    assert (row["language"], row["consent_language"]) == ("zh", "zh")
    assert f"consent in zh: `{row['consent_sha256']}`" in export.codebook_md(study, simulated=False)


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_stored_is_a_list_of_the_words_that_are_hashed(app, language):
    study = app.extensions["study"]
    parts = study.consent_parts(language)
    assert [kind for kind, _ in parts] == ["text", "heading", "list", "text"]
    said = "\n\n".join(study.consent(language))
    for kind, part in parts:
        for one in part if kind == "list" else (part,):
            assert one in said
    assert len(dict(parts)["list"]) >= len(RECORDED)


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("What is stored: {recorded}.", "heading list"),
        ("One.\n\nTwo. Stored: {recorded}", "text text heading list"),
        ("Stored are {recorded}.", "text"),  # no colon
        ("Stored: {recorded}, for ten years.", "text"),  # the sentence goes on
        ("No.", "text"),
    ],
)
def test_a_consent_of_the_studys_own_is_a_list_where_it_can_be(tmp_path, write_study, text, kinds):
    study = create_app(write_study(tmp_path / "study", consent=text)).extensions["study"]
    parts = study.consent_parts("en")
    assert " ".join(kind for kind, _ in parts) == kinds
    plain = " ".join(one for kind, one in parts if kind == "text")
    assert "{recorded}" not in plain and ("your self-rating; " in plain) == ("Stored" in plain)


@pytest.mark.parametrize("language", FURTHER)
def test_no_page_mixes_languages(person, language, asked):
    """No message of the sources stands on a page of another language."""
    visitor = person()
    visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = language
    sentences = [one for one in asked if isinstance(one, str) and len(one) > 14 and "%" not in one]

    def check():
        text = re.sub(r"\s+", " ", visitor.page.text)
        assert not [one for one in sentences if one in text], visitor.path

    visitor.get("/")
    check()
    visitor.send("consent", consent="no")
    check()
    visitor.send("consent", consent="yes")
    check()
    visitor.send("familiarity")
    check()
    visitor.send("familiarity", familiarity=2)
    check()
    for path in ("/withdraw", "/resume/", "/nothing", "/images/0"):
        visitor.get(path)
        check()
    visitor.page = visitor.http.post("/question", data={"trial": "x"})
    check()
    visitor.get("/question")
    visitor.answer(*[0] * 30)
    assert visitor.path == "/thanks"
    check()


@pytest.mark.parametrize("to", ["//evil.example", "https://evil.example/", "/dashboard/", "x", ""])
def test_the_switch_leads_nowhere_else(person, to):
    visitor = person()
    visitor.get("/")
    form = visitor.form("at") | {"at": to, "language": "it"}
    response = visitor.http.post("/language", data=form)
    assert response.status_code == 303 and response.location == "/"


def test_researchers_read_english(experimenter):
    experimenter.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = "it"
    page = experimenter.get("/dashboard/").text
    assert '<html lang="en">' in page and "Which one?" in page


@pytest.mark.parametrize(
    "changes, error",
    [
        ({"languages": ["en", "it"]}, r"study\.text\.it\.title: missing"),
        ({"languages": ["en", "xx"]}, "a list of some of en, it, pt, zh"),
        ({"text": {"it": ITALIAN}}, "`languages` does not name it"),
        (
            {"languages": ["en", "it"], "text": {"it": {**ITALIAN, "titel": "?"}}},
            r"text\.it\.titel: unknown key",
        ),
        (
            {
                "languages": ["en", "it"],
                "text": {"it": {"title": "Quale?"}},
                "question": {"text": "?", "left_label": "A", "right_label": "B"},
            },
            r"text\.it\.question: missing",
        ),
        (
            {
                "languages": ["en", "it"],
                "text": {"it": {"title": "Quale?", "scale": ["A", "B"]}},
            },
            r"text\.it\.scale: got .* expected 5 texts",
        ),
        (
            {
                "languages": ["en", "it"],
                "text": {"it": {"title": "Quale?", "consent": "{questions}"}},
            },
            r"text\.it\.consent: has other places",
        ),
        (
            {
                "languages": ["en", "it"],
                "text": {"it": {"title": "Quale?"}},
                "before": [{"name": "age", "kind": "text", "text": "Age?"}],
            },
            r"text\.it\.before: missing",
        ),
    ],
)
def test_a_text_that_is_missing_or_of_another_shape_is_named(tmp_path, write_study, changes, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", **changes))


def test_texts_of_every_kind_are_translated_and_part_of_what_was_seen(tmp_path, write_study):
    study = {
        "languages": ["it", "en"],
        "reason": {"share": 1, "ticks": ["pelle"]},
        "pages": {"instructions": "Guardi.", "debrief": "Fine."},
        "before": [{"name": "age", "kind": "scale", "text": "Età?", "options": ["0", "", "99"]}],
    }
    english = {
        "title": "Which?",
        "reason": {"text": "Why?", "ticks": ["skin"]},
        "pages": {"instructions": "Look.", "debrief": "End."},
        "before": {"age": {"text": "Age?", "options": ["0", "", "100"]}},
    }
    folder = write_study(tmp_path / "study", **study, text={"en": english})
    app = create_app(folder)
    definition = app.extensions["study"].definition
    assert definition.question.text == "Quale immagine percepisce come più realistica?"
    other = definition.translated("en")
    assert other.question.text == "Which image looks more realistic?"
    assert other.pages.debrief == "End." and other.before[0].options == ("0", "", "100")
    assert other.reason.ticks == ("skin",) and other.before[0].kind == "scale"
    visitor = app.test_client()
    visitor.get("/", headers={"Accept-Language": "it"})
    with app.extensions["database"].write() as db:
        db.add(Participant(visit="somebody"))
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["study"]["text"]["en"]["pages"]["debrief"] = "The end."
    path.write_text(json.dumps(manifest))
    with pytest.raises(errors.InputError, match=r"text\.en\.pages\.debrief was 'End\.'"):
        create_app(folder)


def test_what_is_kept_of_a_page_is_kept_for_each_language(person, app):
    """Parts of a question that are the same for everybody are made once: each reader gets those of
    their language, and the address under which the server is asked.
    """
    pages = {}
    for name in ("en", "it", "en", "it"):
        visitor = person()
        visitor.http.environ_base["HTTP_ACCEPT_LANGUAGE"] = name
        text = re.sub(r'value="[^"]+"|data-\w+="[^"]*"', "", visitor.begin().page.text)
        pages.setdefault(name, []).append(text)
        assert ("Immagine" in text, "Quale è più reale?" in text) == (name == "it",) * 2
        assert ("Confirm" in text, "Which is more real?" in text) == (name == "en",) * 2
    pieces = {
        name: re.findall(r"(?s)<fieldset.*?</fieldset>", "".join(two))
        for name, two in pages.items()
    }
    assert all(len(two) == 2 and two[0] == two[1] for two in pieces.values())
    assert pieces["it"][0] != pieces["en"][0]
    below = visitor.http.get("/question", base_url="http://localhost/elsewhere").text
    assert 'src="/elsewhere/images/' in below and 'src="/images/' not in below
