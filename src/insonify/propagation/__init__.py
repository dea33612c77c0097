"""How sound travels between the sonar and a point."""
