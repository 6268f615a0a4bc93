"""The messages of the pages in each language, outside of a page too: gettext catalogues in
`translations`, made by `make translations`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from babel.support import NullTranslations, Translations

FOLDER = Path(__file__).parent / "translations"


def message(text: str) -> str:
    """Marks a text for translation where it stands; gettext translates it where it is shown."""
    return text


@cache
def catalogue(language: str) -> NullTranslations:
    """The messages in a language; those of English are what stands in the source."""
    return Translations.load(FOLDER, [language])
