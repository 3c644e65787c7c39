"""Work in processes of their own: workers that end with their parent, private folders, journals."""
