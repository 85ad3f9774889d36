"""Starting points that `casadi-gnc new` writes: modules that run as they stand, and are tested as ours are.

Each is a Python file with the words `Starter` and `starter` in the place of the name, and a mission that flies it.
"""

__all__: list[str] = []
