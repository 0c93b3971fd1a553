"""The physics room: Simulation is its public interface."""
