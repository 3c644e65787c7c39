"""A scene, carried out: contact, error bars, files and pictures."""
