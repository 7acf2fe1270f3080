"""The bundle's folder as a ROS 2 package."""

import xml.etree.ElementTree as ET
from pathlib import Path


def test_the_package_claims_neither_a_licence_nor_an_address_that_nobody_stated(good_folder: Path) -> None:
    package = ET.parse(good_folder / "package.xml").getroot()
    licence, maintainer = package.find("license"), package.find("maintainer")
    assert licence is not None
    assert maintainer is not None
    assert (good_folder / licence.attrib["file"]).is_file()  # REP-149: the file with the licence's text
    assert licence.text == "LicenseRef-README"  # SPDX's form of a licence that is not in its list
    assert maintainer.attrib["email"].endswith(".invalid")  # RFC 2606: an address that cannot exist
