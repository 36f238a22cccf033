"""Features to bytes and back; requests, answers, ageing."""
