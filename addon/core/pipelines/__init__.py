"""How the passes are arranged. A pipeline traces one tile at a time and hands back what every ray ended as."""
