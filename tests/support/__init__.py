"""What several tests share: fixtures, clients, fakes and samples, each module named after what it holds."""
