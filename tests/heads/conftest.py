def pytest_configure(config):
    config.addinivalue_line(
        "markers",
        (
            "network: reads the real head data, from the cache or else from the network (never "
            "skipped)"
        ),
    )
