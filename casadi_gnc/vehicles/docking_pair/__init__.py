"""Two craft that dock by their magnetic coils."""
