"""What is kept: recordings and the folders of finished and waiting work, as plain files that are never half written."""
