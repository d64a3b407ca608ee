"""Networks beside a filter and inside its sensors: trained on records, validated on others."""

from .aided import aided_filter, unaided_filter
from .gates import validation_gate
from .map_learning import SensorMapReport, learn_sensor_map
from .report import AidingReport
from .sensor_maps import SensorMap, SensorMappedModel, unmapped, with_sensor_maps
from .teachers import Smoother
from .training import train_aiding

__all__ = [
    "AidingReport",
    "SensorMap",
    "SensorMapReport",
    "SensorMappedModel",
    "Smoother",
    "aided_filter",
    "learn_sensor_map",
    "train_aiding",
    "unaided_filter",
    "unmapped",
    "validation_gate",
    "with_sensor_maps",
]
