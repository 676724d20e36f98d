"""How the study is run: its stages, jobs, commands, and looking into what it left."""
