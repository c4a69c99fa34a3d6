"""The ports: what services need of the world. vehicles/ and storage/ implement them; tests run one suite per port."""
