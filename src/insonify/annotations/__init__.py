"""Annotated images for training detectors: masks, boxes and label maps of targets, their shadows and their ghosts."""

from insonify.annotations.class_names import CLASSES as CLASSES
from insonify.annotations.class_names import ClassNames as ClassNames
from insonify.annotations.class_names import ClassScheme as ClassScheme
from insonify.annotations.class_names import classes_by_label as classes_by_label
from insonify.annotations.class_names import names_with as names_with
from insonify.annotations.coco import merge_coco as merge_coco
from insonify.annotations.coco import write_coco as write_coco
from insonify.annotations.label_maps import write_label_maps as write_label_maps
from insonify.annotations.labelled_image import ImageAxis as ImageAxis
from insonify.annotations.labelled_image import LabelledImage as LabelledImage
from insonify.annotations.labelled_image import Projection as Projection
from insonify.annotations.labelled_images import labelled_images as labelled_images
from insonify.annotations.yolo import write_yolo as write_yolo
