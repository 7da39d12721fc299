"""The paper's experiments; what they share lies beside their folders."""
