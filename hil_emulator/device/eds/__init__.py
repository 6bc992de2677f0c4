"""Electronic data sheets (CiA 306): what they say of a device, whoever wrote them."""
