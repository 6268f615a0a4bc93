"""The documents' claims as experiments: samples, what chapter 4 of the thesis shows, cost."""
