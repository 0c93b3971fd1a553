"""What contacts and limits answer: Newton's, Signorini's and Coulomb's laws, solved."""
