"""Terms that no effect declares, by balance and regressor, used to find what the model lacks."""
