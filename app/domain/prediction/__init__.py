"""The prediction: what a plan will do, item by item."""

from app.domain.prediction.predict import predict
from app.domain.prediction.timeline import PredictedAlternate, PredictedDrop, Timeline, TimelineEntry
from app.domain.prediction.wind import Wind

__all__ = ["PredictedAlternate", "PredictedDrop", "Timeline", "TimelineEntry", "Wind", "predict"]
