"""Data sets: labelled images about one scenario whose values vary, with twins, splits and a card."""

from insonify.datasets.dataset import dataset as dataset
from insonify.datasets.dataset import load_dataset as load_dataset
from insonify.datasets.dataset import make_dataset as make_dataset
from insonify.datasets.dataset_file import DatasetFile as DatasetFile
