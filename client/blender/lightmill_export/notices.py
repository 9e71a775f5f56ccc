"""Notices for people about everything that a document cannot express."""


class Notices:
    """An ordered set of notices. `about` names the object or material that is being read."""

    def __init__(self):
        self.texts = []
        self.about = ""

    def add(self, text):
        if text not in self.texts:
            self.texts.append(text)

    def node(self, node, text):
        """Adds a notice about a node."""
        label = f"{node.name} ({node.bl_label})" if node.name != node.bl_label else node.name
        self.add(f"{self.about}: node {label}: {text}")

    def here(self, text):
        self.add(f"{self.about}: {text}")
