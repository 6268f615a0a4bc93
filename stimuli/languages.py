"""The languages in which people are asked, and the study's texts in each of them.

The texts of a study stand in its first language; `[text.it]` and the like hold them in the others,
in the same shape, and all of them: a text that is missing is an error, so that no page ever mixes
languages by itself.
"""

import re
from typing import Any

from stimuli.errors import InputError
from stimuli.table import Table

#: Languages that the pages speak, by their names in themselves.
LANGUAGES = {"en": "English", "it": "Italiano", "pt": "Português", "zh": "简体中文"}
#: What a page's `lang` says where it is more than the name (BCP 47): browsers choose fonts by it.
TAGS = {"zh": "zh-Hans"}
#: What a consent text may say in braces; the page fills it in from what is asked and stored.
PLACEHOLDERS = ("questions", "minutes", "recorded")
#: For studies of ready-made images that bring no text of their own.
CONSENT = {
    "en": "You will see pairs of images and answer one question about each pair. There are "
    "{questions} questions; most people need {minutes} minutes, and there is no time limit. What "
    "is stored: {recorded}. No name, address or other personal detail is asked for. Taking part is "
    "voluntary: you can close the page at any time. The answers are analysed and published as "
    "statistics and as an anonymous table.",
    "it": "Vedrà coppie di immagini e risponderà a una domanda su ogni coppia. Le domande sono "
    "{questions}; di solito bastano {minutes} minuti e non c'è alcun limite di tempo. Che cosa "
    "viene registrato: {recorded}. Non si chiedono nome, indirizzo o altri dati personali. La "
    "partecipazione è volontaria: può chiudere la pagina in qualsiasi momento. Le risposte vengono "
    "analizzate e pubblicate come statistiche e come tabella anonima.",
    "pt": "Você verá pares de imagens e responderá a uma pergunta sobre cada par. São {questions} "
    "perguntas; a maioria das pessoas precisa de {minutes} minutos e não há limite de tempo. O que "
    "é registrado: {recorded}. Não se pede nome, endereço nem outro dado pessoal. A participação é "
    "voluntária: você pode fechar a página a qualquer momento. As respostas são analisadas e "
    "publicadas como estatísticas e como tabela anônima.",
    "zh": "您将看到成对的图像，并就每一对回答一个问题。共有 {questions} 个问题；大多数人需要 "
    "{minutes} 分钟，没有时间限制。我们会记录：{recorded}。我们不会询问姓名、地址或其他个人信息。"
    "参与完全自愿：您可以随时关闭页面。回答将被分析，并以统计结果和匿名表格的形式发表。",
}
#: What is asked about two images and a reference where the study does not say.
CLOSER = {
    "en": "Which image is closer to the reference?",
    "it": "Quale immagine è più vicina al riferimento?",
    "pt": "Qual imagem está mais próxima da referência?",
    "zh": "哪张图像更接近参考图像？",
}
#: What is asked for a reason where the study does not say.
WHY = {"en": "Why?", "it": "Perché?", "pt": "Por quê?", "zh": "为什么？"}


def read_languages(table: Table) -> tuple[str, ...]:
    """`languages` of a study: the first is that of its texts, and of people who read none."""

    def known(value: list) -> bool:
        return bool(value) and {*value} <= {*LANGUAGES} and len({*value}) == len(value)

    names = ", ".join(LANGUAGES)
    return tuple(table.take("languages", list, f"a list of some of {names}", known, default=["en"]))


def read_texts(
    table: Table,
    languages: tuple[str, ...],
    own: dict[str, Any],
    defaults: dict[str, dict[str, Any]],
) -> dict[str, dict[str, Any]]:
    """`[text]` of a study: language -> its texts, in the shape of `own`, the study's texts.

    defaults: language -> texts that stand where the table has none. InputError names what is
    missing, unknown or of another shape.
    """
    text = table.table("text", default={})
    texts = {}
    for language in languages[1:]:
        entry = text.table(language, default={})
        entry.value = {**defaults[language], **entry.value}
        texts[language] = _alike(entry, own)
        _same_placeholders(entry, texts[language]["consent"], own["consent"])
    for language in set(text.value) & set(LANGUAGES) - set(languages[1:]):
        raise text.fault(language, text.value[language], "no texts: `languages` does not name it")
    text.end()
    return texts


def _alike(table: Table, own: dict[str, Any]) -> dict[str, Any]:
    """The texts of a table, checked to be those of `own`: no other, none missing."""
    texts: dict[str, Any] = {}
    for key, text in own.items():
        if isinstance(text, dict):
            texts[key] = _alike(table.table(key, **({} if text else {"default": {}})), text)
        elif isinstance(text, str):
            texts[key] = table.text(key)
        else:
            expected = f"{len(text)} texts, one for each of the study's own: {', '.join(text)}"
            texts[key] = table.take(key, list, expected, lambda value, own=text: _each(value, own))
    table.end()
    return texts


def _each(value: list, own: list[str]) -> bool:
    """Whether there is a text for each of the study's own, which may be blank where that is."""
    alike = len(value) == len(own) and all(isinstance(one, str) for one in value)
    return alike and all(bool(one.strip()) == bool(other.strip()) for one, other in zip(value, own))


def placeholders(text: str) -> list[str]:
    """What a text has in braces."""
    return re.findall(r"\{([^{}]*)\}", text)


def _same_placeholders(table: Table, text: str, own: str) -> None:
    if set(placeholders(text)) != set(placeholders(own)):
        wanted = ", ".join(f"{{{name}}}" for name in sorted({*placeholders(own)})) or "nothing"
        raise InputError(
            f"{table.source}: {table.at('consent')}: has other places to be filled in than the "
            f"study's own, expected {wanted} in braces"
        )
