"""The report of a result: one page of HTML with figures, tables and a glossary."""
