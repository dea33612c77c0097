"""Files that recordings are kept in and exchanged by."""
