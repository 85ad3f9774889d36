"""What the tables of a problem file are made of: numbers with ranges, matrices, parts that several crafts share."""
