"""What a participant sees: consent, self-rating, questions, thanks, withdrawal."""

from app.questionnaire.views import blueprint

__all__ = ["blueprint"]
