"""Edit a scene in the page: pure changes with undo, a panel of numbers, handles, files."""
