"""Links of node trees, followed through reroutes, groups and muted nodes."""


class Input:
    """An input of a node, inside of the groups that lead to it (outermost first)."""

    def __init__(self, socket, groups=()):
        self.socket = socket
        self.groups = groups

    def source(self):
        """(node, output, groups) of the link to it. Without a link: (None, the input whose own value is used, groups)."""
        socket, groups = self.socket, self.groups
        while True:
            link = next((one for one in socket.links if not one.is_muted and one.is_valid), None)
            if link is None:
                return None, socket, groups
            node, output = link.from_node, link.from_socket
            if node.mute:
                inner = next((one for one in node.internal_links if one.to_socket == output), None)
                if inner is None:
                    return None, None, groups
                socket = inner.from_socket
            elif node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.type == "GROUP" and node.node_tree is not None:
                end = active_output(node.node_tree, "GROUP_OUTPUT")
                inner = end and same_identifier(end.inputs, output)
                if inner is None:
                    return None, None, groups
                socket, groups = inner, (*groups, node)
            elif node.type == "GROUP_INPUT" and groups:
                outer = same_identifier(groups[-1].inputs, output)
                if outer is None:
                    return None, None, groups
                socket, groups = outer, groups[:-1]
            else:
                return node, output, groups

    def node(self):
        return self.source()[0]


class Node:
    """A node inside of groups. It remembers which of its inputs were read."""

    def __init__(self, node, groups=()):
        self.node = node
        self.groups = groups
        self.read = set()

    def input(self, *names):
        """The first input that has one of these names or numbers. Blender versions name some differently."""
        for name in names:
            if isinstance(name, int) or name in self.node.inputs:
                socket = self.node.inputs[name]
                self.read.add(socket.identifier)
                return Input(socket, self.groups)
        return None

    def name_unread(self, notices):
        """Adds notices that nodes linked to the other inputs are left out."""
        for socket in self.node.inputs:
            if socket.enabled and socket.identifier not in self.read:
                source = Input(socket, self.groups).node()
                if source is not None:
                    notices.node(source, f"links to {socket.name} of {self.node.name} are ignored")


def same_identifier(sockets, wanted):
    return next((socket for socket in sockets if socket.identifier == wanted.identifier), None)


def active_output(tree, kind):
    ends = [node for node in tree.nodes if node.type == kind]
    return next((node for node in ends if node.is_active_output), ends[0] if ends else None)


def output_of(tree):
    """The output node that Cycles renders."""
    return tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
