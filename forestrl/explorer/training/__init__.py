"""How the explorer and the linear score are trained: whole episodes, compiled."""
