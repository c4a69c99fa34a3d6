"""The delivery report as an HTML page with SVG, without scripts."""
