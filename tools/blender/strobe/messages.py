"""Messages about replaced features, each once."""


class Messages:
    """Collects messages and gives them to a function."""

    def __init__(self, show):
        """`show(text)` shows one message."""
        self._show, self._known, self.all = show, set(), []

    def add(self, name, text):
        """Shows a message about an object or material."""
        if (name, text) not in self._known:
            self._known.add((name, text))
            self.all.append(f"{name}: {text}")
            self._show(self.all[-1])
