"""The prediction of a plan, item by item."""

from app.domain.prediction.motion import CALM, Wind, WindGiven
from app.domain.prediction.predict import Prediction, predict, predict_all
from app.domain.prediction.timeline import PredictedAlternate, PredictedDrop, Timeline, TimelineEntry

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
