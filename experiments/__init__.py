"""The paper's experiments; the modules beside their folders are shared."""
