"""Gusts of unit variance, by a filter of second order (Dryden's transverse shape) or as a train of shots."""
import numpy as np

TAU_W = 0.15  # s, integral of the correlation to its first zero
TAU = TAU_W / 0.5677  # s, of the filter: e^-x (1 - x/2) integrates to 0.5677 up to x = 2


class Gusts:
    """(1 + sqrt(3) tau s)/(1 + tau s)^2 driven by white noise, and by Poisson shots in the flights whose `shots` > 0 (rate per s).

    A train of shots has the spectrum of the noise, and the same variance: only its tails differ.
    """

    def __init__(self, shots, dt):
        self.share = np.where(shots > 0, shots * dt, 1.0)[:, None]
        self.alpha = dt / TAU
        self.first = np.zeros((len(shots), 3))
        self.second = np.zeros((len(shots), 3))
        self.scale = 1 / np.sqrt(self.variance())

    def variance(self):
        """Of the filter's output for unit noise: Lyapunov's equation by iteration."""
        a = self.alpha
        step = np.array([[1 - a, 0], [a * (1 - a), 1 - a]])
        drive = np.array([a, a * a])
        covariance = np.zeros((2, 2))
        for _ in range(int(20 / a)):
            covariance = step @ covariance @ step.T + np.outer(drive, drive)
        out = np.array([np.sqrt(3), 1 - np.sqrt(3)])
        return out @ covariance @ out

    def step(self, normal, uniform):
        """(flights, 3) from a normal (flights, 3) and a uniform (flights, 1) draw."""
        noise = normal * (uniform < self.share) / np.sqrt(self.share)
        self.first += self.alpha * (noise - self.first)
        self.second += self.alpha * (self.first - self.second)
        return self.scale * (np.sqrt(3) * self.first + (1 - np.sqrt(3)) * self.second)
