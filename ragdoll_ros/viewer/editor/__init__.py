"""Editor of a scene in the page: pure changes with undo, a form, handles, files."""
