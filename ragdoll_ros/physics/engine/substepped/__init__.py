"""What the engines share that go in equal substeps: PyBullet and MuJoCo."""
