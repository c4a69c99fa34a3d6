"""The prediction: what a plan will do, item by item."""

from app.domain.prediction.predict import Prediction, predict, predict_all
from app.domain.prediction.timeline import PredictedAlternate, PredictedDrop, Timeline, TimelineEntry
from app.domain.prediction.wind import CALM, Wind
from app.domain.prediction.wind_given import WindGiven

__all__ = [
    "CALM",
    "PredictedAlternate",
    "PredictedDrop",
    "Prediction",
    "Timeline",
    "TimelineEntry",
    "Wind",
    "WindGiven",
    "predict",
    "predict_all",
]
