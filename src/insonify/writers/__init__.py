"""Writers of recordings in the formats of other programs; `insonify.export` chooses one by the name of the file."""
