import pytest

from tests.core.generate import scenes


@pytest.fixture(scope="session")
def front_scene():
    return scenes.front_scene()


@pytest.fixture(scope="session")
def appliance_scene():
    return scenes.appliance_scene()


@pytest.fixture(scope="session")
def bottle_scene():
    return scenes.bottle_scene()


@pytest.fixture(scope="session")
def chair_scene():
    return scenes.chair_scene()
