"""The helical gear pair with pitch error of Pan 2021."""
