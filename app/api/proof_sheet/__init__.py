"""The proof of delivery as a page: HTML with SVG, no scripts."""
