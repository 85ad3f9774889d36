"""A chaser close to a tumbling target."""
