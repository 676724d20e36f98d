"""Tables as columns of text: of CSV, workbooks, MATLAB, arrays; translated, and checked cell by cell."""
