"""What people look at: sentences, figures and the self-contained HTML page.

Nothing is gathered here: `identification_report` loads matplotlib, and whoever only wants `words` need not wait for it.
"""
