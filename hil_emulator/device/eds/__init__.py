"""Reader of electronic data sheets (CiA 306), including common deviations from the standard."""
