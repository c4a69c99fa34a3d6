"""The delivery report as a page: HTML with SVG, no scripts."""
