"""The prediction: what a plan will do, item by item."""

from app.domain.prediction.predict import predict
from app.domain.prediction.timeline import PredictedAlternate, PredictedDrop, Timeline, TimelineEntry
from app.domain.prediction.wind import CALM, Wind
from app.domain.prediction.wind_given import WindGiven

__all__ = ["CALM", "PredictedAlternate", "PredictedDrop", "Timeline", "TimelineEntry", "Wind", "WindGiven", "predict"]
