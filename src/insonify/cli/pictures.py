"""Start of matplotlib for one picture."""


def start_drawing() -> None:
    """Import matplotlib without the docstrings that it writes for a hundred classes, a tenth of drawing a picture.

    Only the command line does without them: its process ends with the picture.
    """
    from matplotlib.artist import Artist

    if hasattr(Artist, "_update_set_signature_and_docstring"):
        Artist._update_set_signature_and_docstring = classmethod(lambda cls: None)
