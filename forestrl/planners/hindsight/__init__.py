"""What is attainable at all: a short walk through an arena that is known beforehand."""
