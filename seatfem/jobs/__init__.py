"""Jobs in separate processes: workers that end with their parent, private folders, journals."""
